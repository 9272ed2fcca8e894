"""Verifies a webhook with `standardwebhooks`: reads the secret, the headers and the body as JSON from standard input.

Prints the payload, and fails for a signature that does not fit.
"""

import json
import sys

from standardwebhooks import Webhook

given = json.load(sys.stdin)
print(json.dumps(Webhook(given["secret"]).verify(given["body"], given["headers"])))
