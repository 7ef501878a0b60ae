"""Which torques tell the numbers that are to be identified, and do the intervals hold?"""
