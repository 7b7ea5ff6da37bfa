"""The papers' figures and tables, one folder a paper."""
