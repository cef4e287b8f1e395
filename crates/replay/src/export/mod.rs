//! States of a log for other programs.
