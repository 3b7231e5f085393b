"""Reports for people: the place of a failure, its picture, and a page."""
