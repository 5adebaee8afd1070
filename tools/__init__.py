"""Small programs for those who look after covertool."""
