"""Programs that tests run in processes of their own."""


def hide_pandas(folder):
    """Keep programs that start in a folder from pandas.

    pyarrow imports it wherever it can, and that takes longer than most of these programs.
    """
    (folder / "pandas.py").write_text("raise ImportError\n", encoding="ascii")
