"""The recipe of the sample study: a synthetic Maynooth-like town, grown from one seed."""
