"""Robots in space: serial chains of revolute and prismatic joints."""
