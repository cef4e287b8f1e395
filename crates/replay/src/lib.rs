//! agglo's log: typed reading, particle sources and analysis of MCAP logs.
