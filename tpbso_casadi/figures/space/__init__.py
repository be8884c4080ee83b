"""Pictures of robots in space: views that can be measured in, and one in perspective."""
