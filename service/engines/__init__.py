"""The processes that do jobs, and the threads of the server that look after them.

    engine     jobs claimed, leases renewed, everything started and stopped
    single_place  one place for jobs that its caller hands to it
    lease_keeper  leases renewed, and jobs that are to end heard of
    slot       one place for one job at a time: a warm process and the claims it works at
    attempt    one try at a job, from handing over to what came of it
    drawing    the pages of jobs, when somebody asks for them
    recording  what came of it, written to the stores
    signals    how its threads reach each other: a bell, and orders for attempts
    idleness   for how long there has been nothing to do
    trouble    what keeps it from working, and for how long it waits
    process    the server's end of a process
    environment, confinement, socket_filter   what a process is given, and gives up, before it reads
    worker     the other end: what runs in the process
    work/      what is done for each kind of job, by the library

Only ``work`` imports the library, and only worker processes import ``work``: the server stays small
and no mesh can harm it.  What comes from a process is JSON that is checked, never a pickle.
"""
