"""The ladder of methods: what accuracy costs in time, and the cheapest that looks right."""
