"""Identity of a policy: what its actions depend on, as digests that are equal in every process."""
