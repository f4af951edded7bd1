"""Forward and inverse kinematics of serial chains; no other room depends on the form of an arm."""
