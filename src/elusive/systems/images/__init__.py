"""Image sequences: targets too faint to threshold."""
