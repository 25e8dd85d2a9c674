"""What is done for each kind of job.  Worker processes alone import this: it loads the library."""
