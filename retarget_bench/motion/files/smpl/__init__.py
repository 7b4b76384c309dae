"""Motions of the SMPL family of body models: AMASS archives, and arrays of joint positions and features."""
