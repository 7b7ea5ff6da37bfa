"""Davies and Garcia-Fernandez (2024): five targets that cross on a field of sensors whose readings add up."""
