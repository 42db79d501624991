"""What several tests share: scenes, oracles, made-up records, ways to run a program."""
