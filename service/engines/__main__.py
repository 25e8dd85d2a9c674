"""``python -m service.engines``: a worker process."""

from service.engines.worker import main

if __name__ == "__main__":
    main()
