"""Work on the nodes of a Ray cluster; Ray executes, and the row of a job decides.

    joining   this process into the cluster, or a refusal in a line
    nodes     which of them run this release, so that the others get no work

Only this package imports Ray, which the extra ``ray`` installs.
"""
