"""Cannot be built."""


class plugin:
    def __init__(self):
        raise OSError("the disk is elsewhere")

    def cases(self, task, split):
        return []
