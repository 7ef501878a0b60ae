"""Which numbers of the robot do logs tell, how well, and what do they not tell?"""
