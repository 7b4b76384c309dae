"""Result files: rows, headers and case lists, written and read back.

Imports motion and the contracts of ``api``; nothing that makes results.
Offers the store, headers, metadata of cases, compatibility of versions, columns and the result matrix.
"""
