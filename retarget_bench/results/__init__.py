"""Result files: how rows, headers and case lists are written, read back and brought to one version.

Imports the contracts of ``api``; knows nothing of how results are made.
Offers the store, headers, metadata of cases, compatibility of versions, columns and the result matrix.
"""
