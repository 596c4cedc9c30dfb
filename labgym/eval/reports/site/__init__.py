"""The site on evaluations of LabNav: one page on which policies are compared, with a viewer of episodes."""
