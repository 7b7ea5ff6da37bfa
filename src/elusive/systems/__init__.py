"""The six kinds of recording, a folder each: parameters, track, fit, scene, report, page."""
