"""Reading a trace: from a file or a table in memory to samples in SI, checked, and repaired where that is asked for.

Files in the order of the data; none imports one that stands after it:

headers→dialects→scope_csv→table→text_table→files→columns→counters→stamps→clocks→jumps→checks→holds→samples→repair
"""
