"""Bootsveld (2012), Dealing with imperfect knowledge in sensor processing: ships near imprecisely charted coasts."""
