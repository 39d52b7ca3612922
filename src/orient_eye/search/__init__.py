"""The best action for a saccade: searched, searched again by another program, remembered, and taken along.

`optimum` the search, `simplex` its steps, `second_search` the other program, `optimum_file` an optimum in a file,
`optimum_cache` what is not searched again.
"""
