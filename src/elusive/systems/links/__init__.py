"""Radio networks: people without devices, by what they do to the links."""
