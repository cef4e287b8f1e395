//! A valid log of all that is whole in a damaged one.
