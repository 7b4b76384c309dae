"""The parts of ``bench retarget``: one retargeting, and many of them.

``job`` carries out one retargeting of files with a skeleton, ``scans`` one of scans, ``batch`` many jobs
that ``plan`` has listed.
"""
