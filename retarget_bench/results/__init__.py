"""Result files: how rows, headers and case lists are written, read back and brought to one version.

Imports motion and the contracts of ``api``; nothing that makes results.
Offers the store, headers, metadata of cases, compatibility of versions, columns and the result matrix.
"""
