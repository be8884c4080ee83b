"""Files of meshes: STL, OBJ and DAE, of which every element with a surface is read, or the file refused."""

from problems.geometry.mesh_files.dae import read_dae
from problems.geometry.mesh_files.faces import MOST_TRIANGLES, Content, Part, refused
from problems.geometry.mesh_files.obj import read_obj
from problems.geometry.mesh_files.stl import read_stl

__all__ = ["MOST_TRIANGLES", "Content", "Part", "read_dae", "read_obj", "read_stl", "refused"]
