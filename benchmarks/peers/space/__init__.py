"""What others plan for robots among obstacles: OMPL with TOPP-RA, and Drake."""
