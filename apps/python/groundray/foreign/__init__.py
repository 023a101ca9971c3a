"""Files of other programs, which groundray's programs read by running modules of this package."""
