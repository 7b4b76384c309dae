"""The corpus: who performs what, lists of clips and cases, training and test parts.

May import all other rooms. Offers ``generated.Generated``."""
