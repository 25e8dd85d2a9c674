"""Exit status 0 when the server of this container answers that it is well."""

import os
import sys
from urllib.request import urlopen

address = f"http://127.0.0.1:{os.environ.get('OCCLUDER_PORT', '8000')}/healthz"
try:
    with urlopen(address, timeout=4) as answer:
        sys.exit(answer.status != 200)
except OSError as error:
    sys.exit(f"{address}: {error}")
