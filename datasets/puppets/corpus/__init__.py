"""The corpus: who performs what, lists of clips and cases, training and test parts, the data set.

May import all other rooms. Offers ``dataset.Puppets``."""
