"""Formats that other people's tools read, and their recordings read in.

record.py      saccades as an eye tracker records them: one recording at one rate, with rests and gaps
gaze.py        a recording of gaze, ours or a person's, and the saccades that a velocity threshold finds in it
bids.py        a data set of eye tracking by the Brain Imaging Data Structure
parquet.py     columns of Parquet files
eye_tables.py  a person's recording of gaze, from a table
"""
