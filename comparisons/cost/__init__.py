"""What accuracy costs in time: a ladder of methods, the price of effects, the departure's parts."""
