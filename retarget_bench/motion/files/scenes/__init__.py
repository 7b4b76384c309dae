"""Bodies in files that hold a tree of nodes (glTF, FBX): one set of rules, whatever the format.

A format gives a ``Scene``: nodes, skins, takes and meshes as its file states them. Which nodes are joints,
how the skeleton stands, which take is read, and how meshes lie on the joints is decided here.
"""
