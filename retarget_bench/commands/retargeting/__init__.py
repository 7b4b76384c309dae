"""The parts of ``bench retarget``: its options, one retargeting, and many of them.

``options`` has the options, ``job`` carries out one retargeting of files with a skeleton, ``scans`` one of
scans, ``batch`` many jobs that ``plan`` has listed.
"""
