"""Any periodic motion of a contact: its mean friction, the motion that gives one, samples."""
