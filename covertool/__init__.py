"""How much of a town's road would parked cars cover, and what would that save in metres?"""

__version__ = "0.1.0"
