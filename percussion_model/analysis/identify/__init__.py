"""Rock from drilling data: a log of a rig through a filter, and what it can tell.

`profile.identify` gives the rock along a hole, `plan.plan` what to change in the next metre;
`filter.RockFilter` takes samples one by one. Logs are read by `interface.drill_log.read_log`.
"""
