"""The generator of every corpus but size ``tiny``, which is read without it.

``performances`` says what is done, in terms that fit every body of ``bodies``; ``solver`` has bodies do it;
``corpus`` lists who does what, and gives the data set its motions.
"""
