"""The parts of ``bench retarget``: its options, one retargeting, and many of them.

``options`` are the groups of options, ``job`` carries out one retargeting of files with a skeleton,
``scans`` one of scans, ``batch`` many jobs that ``plan`` has listed.
"""
