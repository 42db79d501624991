"""The tests: unit, statistical and physical; the benchmarks beside them."""
