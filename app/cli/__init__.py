"""The console command `joulepath`: the service, and its requests without HTTP."""
