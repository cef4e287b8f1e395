//! What a log tells, recomputed from states, impacts and scene in one pass.
