"""A stated model of responses and a design enter, simulated answers leave: over HTTP like people's, or as numbers for power.

What robots answer is made up. It shows that a study runs and what an analysis would find if people were like the model; it says
nothing on people. Every file and page that holds such answers says that they are simulated.
"""
