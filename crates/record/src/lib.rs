//! agglo's recorder: solver states to MCAP messages.
