"""Tables and report pages made from results."""
