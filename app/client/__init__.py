"""`joulepath.Client`: the functions of the library over HTTP."""
