"""From a recording to tracks: one module for each kind of recording."""
