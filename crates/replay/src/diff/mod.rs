//! Comparing two logs.
