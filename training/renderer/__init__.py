"""A seeded renderer of top views with labelled cars, drawn with NumPy and OpenCV alone."""
