"""The sample study; its recipe is `data.recipe`."""
