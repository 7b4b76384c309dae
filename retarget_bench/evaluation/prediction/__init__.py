"""Methods in processes of their own, which are asked by files and hold no right answer.

``question_files`` writes and reads what travels, ``channel`` carries the lines between two processes,
``answering`` is the loop of a prediction worker, and ``workers`` starts, limits and ends such processes.
``environments`` starts them in other Pythons, where ``other_python`` or ``numpy_worker`` is what runs.
"""
