"""What a run folder says of itself: whose it is, who works in it, what it holds for an archive."""
