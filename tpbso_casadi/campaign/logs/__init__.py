"""The histories of a campaign in the data formats of COCO and IOHprofiler."""
