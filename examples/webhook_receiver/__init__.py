"""A receiver of the service's webhooks that writes occluders back to the pipeline's folder.

server   one request: is it short, signed and fresh
writing  one word: what is to be written where, the download, the command that follows
ledger   which words were heard before, and how new each file is

python -m examples.webhook_receiver --server http://127.0.0.1:8000 --folder assets
"""
