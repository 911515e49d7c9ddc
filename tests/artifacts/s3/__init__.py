"""An S3 server on this machine, for the tests of object stores."""
