"""The prone-to-supine pipeline: the only part of Supple that knows anatomy."""
