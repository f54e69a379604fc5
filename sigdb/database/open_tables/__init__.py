"""Registration of the Parquet files of a database as tables of open formats: Delta Lake and Apache Iceberg."""
