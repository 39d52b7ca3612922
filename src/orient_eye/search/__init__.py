"""The best action for a saccade: searched (`optimum`), searched again by another program, and remembered."""
