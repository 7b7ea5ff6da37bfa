"""Mazurek (2013), Performance of Dot-product preprocessing for Track-Before-Detect tracking of noise objects."""
