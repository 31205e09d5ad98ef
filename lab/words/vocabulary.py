"""The words of the grammar: each kind of word with the words and phrases that stand for it.

A kind that the grammar does not name is a slip in this table (tests/words/test_vocabulary.py). A word may stand in several kinds:
the grammar says which of them fits. Names of objects, parts and stations come from the scene, numbers and lengths from the reader.
"""

from collections.abc import Mapping

# words without a meaning of their own, wherever they stand
SKIPPED = frozenset(("the", "please", "pls", "plz", "just", "really", "very", "kindly", "exactly", "simply", "actually"))

FILLERS = (
    "the|your|my|its|their|his|our|please|pls|plz|kindly|just|really|very|actually|simply|exactly|hmm|hm|uh|um|er|eh|oh|ah"
    "|ok|okay|alright|all right|hey|hello|hi|dear|buddy|friend|mate|robot|little robot|machine learning|now|right now|maybe"
    "|perhaps|sorry|thanks|thank you|thank you very much|thx|ta|cheers|if you would|if you please|if you can|if possible"
    "|if you do not mind|for me|with you|could you|can you|would you|will you|would you be so kind|be so kind|be so kind as to"
    "|would you be so kind as to|could we|can we|could we have|can we have|could i have|would you mind|do you mind"
    "|i want you|i want you to|i want you to be|i would like you|i would like you to|i would like you to be|i need you to"
    "|i need you|i ask you to|i would say|i would like that you|i want that you|i would like it if you|i wish you would|i wish you to|i wish that you|i wish you|oops|ups|whoops|let me|i would|i think|i guess|i suppose|i suggest|i say|i said|i mean|i meant"
    "|i would like to|i want to|i would like|i want"
    "|i would prefer|it would be nice if you|it would be good if you|it would be great if you|you should|you should to|you must"
    "|you have to|you need to|you ought to|you could|you had better|better|try to|try|let us|let us say|how about|what about"
    "|do me a favour and|do me a favor and|feel free to|go ahead and|go and|be a dear and|be nice and|quickly|slowly|carefully"
    "|gently|quick|immediately|at once|straight away|right away|directly|sideways|hand|arm|gripper|tool|well|so|for now"
    "|from here|from there|from now on|from where you are|where you are|then please|i beg you|you know|in a curve"
    "|in a bow|in an arc|in a circle|in a wide arc|in a big circle|shortest path|shortest way|shortest route|quickest way"
    "|quickest path|quickest route|direct way|direct path|direct route|by shortest path|by shortest way|by shortest route"
    "|on shortest path|on shortest way|nice and slow|man|guys|folks|precisely|completely around|come on|listen|look|as i said"
    "|of course|sure|surely|certainly|indeed|definitely|strictly|finally then|wait|hang on|hold on|would rather|rather"
    "|instead|please do|do please|also|too please|as well|somewhat|total|in total|altogether|only then|though|exact|single|whole"
    "|full|further on|grid|thank u|ur|urself"
)

COMMON: Mapping[str, str] = {
    "FILLER": FILLERS,
    # separators
    "COMMA": ",|:",
    "DOT": ".|!|?|;",
    "AND": "and|plus|but|n",
    "THEN": "then|and then|afterwards|afterward|after that|after this|after which|thereafter|thereupon|finally|lastly"
    "|subsequently|followed by|once there|when there|in the end|at the end|secondly|second|third|thirdly|last|as next|as a next step"
    "|in next step|when you are there|once you are there|from there on|when that is done|once that is done|when done|and after"
    "|and after that|and finally|and lastly|and next|next up",
    "FIRST": "first|firstly|first of all|at first|to begin with|to start with|for a start|to start|before anything",
    "NEXT": "next|following|coming|upcoming",
    "AFTER": "after|once|when|as soon as",
    # small words
    "A": "a|an|another",
    "NO": "no|nope|nah|without|no no|no no no|no more of",
    "NOT": "not|do not|must not|does not|did not|may not|can not|should not|shall not|would not|will not|is not to|are not to"
    "|do not ever|do not you|do not you dare|under no circumstances|in no case|am not|you must not|you should not|you may not"
    "|you can not|you shall not|you are not to|you will not|i do not want you to|i do not want you|i would not|not yet",
    "PLAIN_NOT": "not|never",
    "NEVER": "never|never ever|not ever|do not ever|should never|must never|may never|shall never|can never|you should never"
    "|you must never|you may never|at no time|not at any time|never again",
    "BE": "is|are|be|am|was|were|been|being|will be|would be|has been|have been|had been|gets|feels|seems|looks|felt|looked",
    "HAVE": "have|has|had|having|got|has got|have got",
    "YOU": "you|u|yourself|we|i",
    "ME": "me|us",
    "IT": "it|that|this|that one|this one|that thing|this thing|last one|that move|this move|that step|that answer|that last one",
    "THERE": "there|here|in there|over there|in it|on it|inside it",
    "WHAT": "what",
    "CAN": "can|may|might|are allowed to|is allowed to|are free to|am allowed to|are permitted to|could",
    "MUST": "must|should|shall|has to|have to|needs to|need to|ought to|will",
    "DO": "do|does|doing|did|done",
    "IF": "if",
    "AGAIN": "again|once more|one more time|once again|over again|another time|a second time",
    "ANYMORE": "anymore|any more|more|any longer|further|any further|farther|any farther|no longer|longer",
    "OK": "okay|fine|allowed|permitted|safe|harmless|okay now|no problem|ok again|ok now|all right again|allright|open|not a problem"
    "|no danger|not dangerous|not forbidden|not off limits|not hot|not fragile|no longer dangerous|no longer hot"
    "|no longer fragile|no longer forbidden|no longer off limits|no longer a problem|not a problem|unproblematic|ok",
    "TOO": "too|so|pretty|quite|that|extremely|absolutely|totally|rather|particularly|especially|bit|little|much|far too|way too",
    # judgements
    "GOOD": "good|great|nice|perfect|excellent|super|wonderful|brilliant|awesome|amazing|fantastic|lovely|terrific|superb|splendid"
    "|marvellous|marvelous|cool|clever|smart|correct|beautiful|neat|impressive|well done|good job|great job|nice job|good work"
    "|great work|nice work|good move|great move|nice move|bravo|good one|nice one|good robot|good boy|good girl|not bad|not bad at all"
    "|not too bad|keep it up|keep up good work|way to go|thumbs up|much better|good choice|good decision|good step|spot on"
    "|right thing|right move|right choice|right decision|best|right step|quite right|quite good|good thing|a good one"
    "|hooray|hurray|yay|wow|nicely done|nicely|nailed it|you nailed it|you did well|you did great|you are good|you did good"
    "|what i wanted|as i wanted|like i wanted|how i wanted it|i like it|i like that|i like this|i liked that|i liked it|i love it"
    "|i loved that|i am happy|i am happy with that|i am pleased|i am pleased with that|i am very pleased|i am satisfied"
    "|i am satisfied with that|i am impressed|could not be better|nothing to complain about|no complaints|outstanding|sweet"
    "|fabulous|exemplary|congratulations|congrats|kudos|chapeau|first class|first rate|top|like it|love it|liked it|loved it"
    "|great stuff|good stuff|very fine|you are doing well|you are doing great|a success|success|so much better",
    "BAD": "bad|poor|you did badly|you did that badly|you did wrong|you did that wrong|you did it wrong|badly|went wrong|awful|terrible|horrible|stupid|rubbish|mistake|nonsense|wrong|wrong move|wrong step|bad move|bad job|bad robot"
    "|not good|no good|not good at all|not right|not correct|incorrect|not great|not nice|not so good|not very good|not ok|not okay"
    "|not fine|disappointing|silly|worse|worst|dreadful|lousy|ugly|dumb|foolish|useless|badly done|poorly done|poor show|thumbs down"
    "|i do not like that|i do not like it|i did not like that|i did not like it|i do not like this|i hate that|i hated that"
    "|not what i wanted|not how i wanted it|not what i meant|not as i wanted|i am not happy|i am not happy with that|i am unhappy"
    "|i am unhappy with that|i am not pleased|i am not pleased with that|i am not satisfied|i am not satisfied with that"
    "|i am dissatisfied|i am disappointed|not well done|bad choice|poor choice|bad decision|wrong choice|wrong decision|bad idea"
    "|not a good idea|not a good move|not a good choice|bad step|poor move|a bad one|bad one|not clever|not smart|not helpful"
    "|unhelpful|could be better|could have been better|could do better|that will not do|not impressed|i am not impressed"
    "|crap|sucks|that sucks|garbage|unacceptable|not acceptable|fail|failure|a failure|shame|a shame|do not like it|do not like that",
    "JUDGED": "work|job|move|choice|step|decision|1|idea|answer|robot|thing|going|driving|try|attempt|effort|show|performance|result|path|route|way|turn|reaction|start|progress|thinking|boy|girl",
    "ONCE": "once",
    "SENTIMENT": "that was|that is|this is|this was|it was|it is|you are|you were|that one was|that move was|that step was"
    "|that last move was|that last one was|last move was|last step was|last one was|what you did was|what you just did was"
    "|what a|such a|how|what an|such an|that was a|that is a|it was a|it is a|this is a|this was a|that one was a|i found that|i find that|i find this"
    "|i found it|i find it|that move was a|that looks|that looked|that went|it went|this went|your last move was|your last step was|that choice was|that answer was"
    "|that decision was|that way was|way you did that was|way you did it was|i think that was|i think it was",
    # what to do with answers
    "OPPOSITE": "other way|opposite|opposite way|opposite direction|other direction|contrary|contrary direction|contrary way|wrong way"
    "|wrong direction|reverse direction|reversed direction|other way round|other way around|opposite of that|opposite of it"
    "|opposite one|way opposite|inverse direction|inverse|not that way|not this way|not that direction|not this direction"
    "|not in that direction|not in this direction|direction opposite|other side",
    "SAME": "same|like last time|like before|as before|as last time|like previous time|like time before|as usual|ditto|as always"
    "|same as before|same as last time|same like last time|same like before|same again|same thing|same thing again"
    "|same thing as last time|same thing as before|same way|same way as last time|same way as before|same way again"
    "|same procedure as last time|same procedure|same procedure as before|same procedure again|as you did last time"
    "|as you did before|as you did it last time|way you did last time|way you did it last time|way you did before|way you did it before"
    "|like you did last time|like you did before|like you did it last time|like you did it before|as in last episode|as in last try"
    "|like in last episode|like in last try|as in last round|like in last round|same as in last episode|same as in last round"
    "|same as in last try|what you did last time|what you did before|what we did last time|what we did before|like we did last time"
    "|like we did before|as we did last time|as we did before|same as you did last time|same as you did before|like always|like usual"
    "|as previously|like previously|same as previously|same as always|same as ever|same as then|exactly as before|just as before"
    "|just like before|just like last time|just as last time|as on last occasion|like other time|same path as last time"
    "|same path as before|same route as last time|same route as before|same way like before|same way like last time|same path"
    "|same route|same path again|same route again|same moves as last time|same moves as before|same move again|same answer"
    "|same answer as before|same answer as last time|same answer again|same one again|same move as before|same move as last time"
    "|same steps as last time|same steps as before|same steps again|same moves again|same moves|way it was last time"
    "|way it was before|what i said last time|what i said before|what i told you last time|what i told you before"
    "|as i told you last time|as i told you before|as i said last time|as i said before|like i said last time|like i said before"
    "|same as i said before|same as i said last time|last time|way you went last time|way you went before|way you took last time"
    "|path you took last time|route you took last time|same old way|as you did|like earlier|as earlier|same as earlier|same as a moment ago"
    "|same as just now|same as one before|same as time before",
    "REPEAT": "repeat|redo|repeat that|repeat it|repeat last one|repeat last move|repeat last answer|repeat what you did|repeat this"
    "|do that again|do it again|do this again|do same|do same again|do so again|again same|and again|once more same"
    "|repeat last step|repeat your last move|repeat my last answer|repeat that move|repeat previous move|repeat last moves|use last answer again|encore"
    "|repeat that path|repeat last path|repeat last way|repeat previous answer|try that again|do that once more|do it once more|do that one more time|do it one more time",
    "KNOWIT": "you know it already|you know it|you know already|you know that already|you know this|you know this already|you know how"
    "|you already know it|you already know this|you already know|you know what to do|we had that already|we did this before"
    "|we have done this before|you have done this before|you have done it before|you did this before|we have been here before"
    "|you have been here before|you know way",
    "UNDO": "undo|undo that|undo it|undo this|undo last one|undo last answer|undo last move|undo last step|take that back|take it back"
    "|take back|take this back|take back that|take back last answer|take back last one|take back last move|take back my last answer"
    "|take last answer back|take last one back|take last move back|take my last answer back|take back what i said|take back what i just said"
    "|take that one back|take back that one|take that answer back|take that move back|i take that back|i take it back|cancel|cancel that"
    "|cancel it|cancel this|cancel last answer|cancel last one|cancel last move|cancel what you did|cancel what you just did"
    "|cancel what i said|cancel what i just said|cancel that one|cancel that move|cancel that answer|cancel last step|revert|revert that"
    "|revert it|revert last move|revert last answer|revert last step|revert this|scratch that|strike that|undo what you did"
    "|undo what you just did|undo what i said|undo what i just said|undo your last move|undo your last step|undo previous answer"
    "|undo previous move|undo that one|undo that move|undo that answer|undo that step|forget last answer|forget last one|forget my last answer"
    "|forget last move|forget what i just said|forget that answer|forget that last one|delete last answer|delete my last answer"
    "|delete that|delete that answer|remove last answer|remove my last answer|withdraw that|withdraw last answer|withdraw my answer|withdraw my last answer|discard that"
    "|discard last answer|rewind|rewind one|undo previous step|undo last thing|take back last thing|take back last step|take last step back"
    "|reverse that|reverse last move|reverse what you did|reverse what you just did|undo last command|take back last command|cancel last command"
    "|cancel my last answer|cancel previous answer|cancel my answer|take my answer back|take back my answer|i withdraw that|i withdraw my answer"
    "|make that undone|make it undone|i did not mean that|i did not mean it|that was not what i meant to say|back to before that|withdraw it|undo my last answer",
    "UNDOV": "undo|take back|revert|cancel|withdraw|remove|delete|forget|rewind|scratch|discard|reverse|retract|annul|drop|strike",
    "UNDOBJ": "it|that|this|last one|last answer|my last answer|my answer|last move|your last move|last step|previous answer|previous move|that answer|that move|last command|my last command|what i said|what i just said|what you did|what you just did|last action|last instruction|my last instruction|last thing i said|last thing|my last move|my last step|this answer|your last step|my previous answer|that 1|this 1|that last 1|my words|my last words|that last answer|that last move|that step|that command|that instruction|last reply|my last reply|my reply",
    "TAKEV": "take|put",
    "BACKWORD": "back",
    "OWN": "do what you think is best|do what you think best|do what you think is right|do what you want|do what you like|do as you like"
    "|do as you want|do as you please|do as you wish|do whatever you want|do whatever you like|do whatever you think is best"
    "|whatever you want|whatever you like|whatever you think|whatever you think is best|what you think is best|as you like|as you wish"
    "|as you want|as you please|as you think|as you think best|as you see fit|do as you see fit|do as you think|do as you think best"
    "|it is up to you|up to you|that is up to you|entirely up to you|it is your choice|your choice|that is your choice|your own choice"
    "|you choose|you decide|you can decide|you can choose|you may choose|you may decide|decide yourself|decide for yourself"
    "|decide on your own|decide by yourself|decide alone|choose yourself|choose for yourself|choose on your own|choose by yourself"
    "|choose alone|pick yourself|pick for yourself|you pick|pick one yourself|pick one|use your own judgement|use your judgement"
    "|use your own judgment|use your judgment|use your own head|use your head|use your own mind|use your own brain|use your brain|use own judgement|trust yourself|trust your instinct"
    "|trust your instincts|trust your judgement|i trust you|i trust your judgement|you know best|you know better|you know better than me"
    "|you know better than i|follow your plan|follow your own plan|follow your idea|follow your own idea|follow your instinct"
    "|follow your instincts|follow your nose|stick to your plan|stick with your plan|stick to your own plan|stick to your choice"
    "|stick with your choice|keep to your plan|go with your plan|go with your choice|go with your own choice|go with your idea"
    "|go with your own idea|go with your first idea|go with your gut|go with what you think|go with what you think is best"
    "|go with what you have|do your thing|do your own thing|do it your way|do it your own way|go your own way|your own way|have it your way|as you planned|as planned"
    "|do as you planned|do what you planned|do what you had planned|do what you wanted|do what you wanted to do|do what you were going to do"
    "|do what you would do|do what you would have done|as you would have done|do what you intended|do as you intended|as you intended"
    "|your decision|it is your decision|that is your decision|your call|it is your call|that is your call|your move|your turn|your idea is good"
    "|your idea is fine|your choice is fine|your choice is good|your plan is fine|your plan is good|your own idea is fine|your suggestion is fine|your suggestion is good"
    "|do what seems best|do what seems best to you|do what is best|what seems best to you|do what you consider best|do what you believe is best"
    "|do what you feel is right|do what feels right|do what you think|do what you had in mind|go for it|leave it to you|i leave it to you"
    "|i leave that to you|i will leave it to you|i leave decision to you|i leave choice to you|let yourself decide|you can decide yourself|you can decide that yourself"
    "|you can decide for yourself|you decide yourself|you may decide yourself|you may decide for yourself|you should decide|you should decide yourself|take your own decision"
    "|make your own decision|make your own choice|make up your own mind|make your choice|make your own mind up|take your pick|take your own choice|take your choice|act as you see fit"
    "|act on your own|act on your own judgement|i do not mind|i do not care|it does not matter|does not matter|no preference|i have no preference|i am fine with anything"
    "|anything is fine|any is fine|either is fine|suit yourself|be my guest|you are free to choose|you are free to decide|choose freely|decide freely|solve it yourself|figure it out yourself"
    "|figure it out|work it out yourself|find out yourself|find it out yourself|try it yourself|do it yourself|do it alone|do it on your own|try on your own|try your own way|try it your way|try your idea|handle it yourself"
    "|manage yourself|you can do it alone|you can do it yourself|go on alone|go on by yourself|go on on your own|carry on alone|go with your own judgement|over to you"
    "|whichever you like|whichever you want|whichever you prefer|which ever you like|as you prefer|do what you prefer|whatever you prefer|i agree with you|i agree|agreed"
    "|follow your own judgement|follow your judgement|rely on your judgement|rely on your own judgement|rely on yourself|whatever seems best|whatever|whatever works|as you were going to|you can go on as you planned",
    "DUNNO": "i do not know|no idea|i have no idea|i do not know either|not sure|i am not sure|dunno|i dunno|no clue|i have no clue|i can not say|i can not tell|i have no opinion|i really do not know|do not know|hard to say|who knows",
    "YES": "yes|yeah|yep|yup|aye|correct yes|yes yes|right so",
    "GOON": "go on|carry on|continue|proceed|keep going|keep moving|keep on|keep on going|keep driving|keep on moving|keep walking|continue moving|continue going|go on moving|go on going",
    "GOAHEAD": "go ahead|just go ahead|move on",
    "WHY": "why|what for|how come|for what reason|for which reason",
    "WHYASK": "why do you ask|why do you ask me|why did you ask|why did you ask me|why are you asking|why are you asking me|why ask|why ask me|why you ask"
    "|why you ask me|why you asking|why you are asking|why do you want to know|why are you stuck|why do you need me|why do you need help"
    "|why do you need my help|why this question|why question|why that question|why do you ask so much|why do you always ask|why do you keep asking"
    "|why do you need to know|why do you have to ask|why do you need to ask|what is reason|what is reason for question|what is reason for asking"
    "|what is reason for your question|what is reason you ask|what reason do you have|what is reason for this|what is reason for that|what is reason for this question|what is your reason|what is your reason for asking"
    "|reason|explain question|explain your question|explain why|explain why you ask|explain why you ask me|explain why you are asking|tell me why|tell me why you ask"
    "|tell me why you ask me|tell me why you are asking|tell me reason|give me reason|give me a reason|what makes you ask|what made you ask|what makes you ask me|what made you ask me"
    "|how come you ask|how come you ask me|how come you are asking|how come you are asking me|what are you asking for|what do you ask for|what is your problem|why is that a question"
    "|for what reason do you ask|for what reason do you ask me|for what reason are you asking|what do you need me for|why me|why now|why are you asking now|why did you stop|why do you stop|what is question for|why would you ask|why would you ask me|why should you ask|i want to know why you ask|i wonder why you ask|i would like to know why you ask|can you explain why you ask|could you explain why you ask|why are you asking again|why do you ask again",
    "WHYTAIL": "me that|that|this|me this|it|me|me at all|at all|me now|now|here|me here|again|me again|me all time|all time|me such a thing|such a thing|so often|me so often|me questions|questions|a question|me a question|for help|for advice|for my help|me for help|me for advice|me every time|every time|there|in this place|at this place|at this point|me that now|me this now|question",
    "ASK": "ask|asking|ask me|asking me|ask questions|asking questions|ask me questions|asking me questions|bother|bothering|bother me|bothering me"
    "|disturb|disturbing|disturb me|disturbing me|interrupt|interrupting|interrupt me|interrupting me|ask for help|asking for help|ask for advice"
    "|asking for advice|ask for my help|asking for my help|ask me for help|asking me for help|ask me for advice|asking me for advice|ask anything|asking anything|ask me anything|asking me anything"
    "|questions|question|questioning me|ask me again|ask again|pester me|pestering me|annoy me|annoying me|talk|talk to me|talking|talking to me|come to me|call me|ask me about it|ask me any questions|ask any questions"
    "|ask a question|ask me a question|more questions|ask me something|ask something|trouble me|ask me more|ask more questions|ask me more questions|ask me any more questions|ask any more questions|query me|querying me|nag me|nagging me|nag|nagging|have questions",
    "QUIET": "i do not want any questions|i do not want to be asked|i do not want questions|i want no questions|i want no more questions|i do not want any more questions|i do not want to be asked any more|i do not want to be disturbed|i do not want to be asked again|quiet|silent|silence|be quiet|be quite|stay quiet|keep quiet|remain quiet|be silent|stay silent|keep silent|remain silent|shut up"
    "|hush|leave me alone|leave me in peace|leave me be|give me a break|give me a rest|peace|peace and quiet|be still|hold your tongue|hold your questions"
    "|keep your questions to yourself|keep questions to yourself|let me be|let me alone|let me rest|i want peace|i need a break|quite please|let me sleep|no questions|no more questions|do not ask|no further questions|spare me|spare me questions|spare me your questions|no questions asked|work alone|work on your own|work by yourself|do it quietly|work quietly|go it alone|quiet please|silence please|zip it",
    "STOPV": "stop|quit|stop all|cease|enough of|enough|halt|refrain from|give up|avoid asking",
    "NOMOREQ": "no more",
    "STUCK": "stuck|lost|helpless|desperate|at a loss|in trouble|in difficulty|in difficulties|unable to continue|unable to go on|clueless"
    "|at a dead end|at your wits end|out of ideas|blocked|completely stuck|jammed|trapped|totally stuck|hopelessly stuck|stuck again|really stuck|in need|in real trouble|running out of ideas",
    "GETSTUCK": "can not go on|can not continue|can not go on alone|do not know what to do|do not know how to go on|do not know how to continue|need help|really need help"
    "|need it|need me|really need me|really need to|have to|must|really have to|really must|know nothing more|can not help yourself|do not know any more|do not know what to do next|have no idea|have no idea what to do|have no idea any more|can not get on|can not get any further|can not get further|can not proceed|need my help|really need my help|really need it|absolutely must|absolutely have to|can not manage|can not manage alone|do not get any further|get nowhere|do not make progress|make no progress|no longer make progress|can not find a way|find no way|run into trouble|get into trouble|run out of ideas|hit a dead end|do not get on|run into a problem|run into problems|hit a problem|can not do it alone|need a hand",
    "GETS": "get|gets|become|becomes|are getting|get really|get completely|getting|run|has got|have got",
    "EPISODE": "try|episode|round|attempt|run|this try|this episode|this round|this attempt|this time|this one|this run|rest of try|rest of episode"
    "|rest of this try|rest of this episode|rest of round|rest of this round|rest of attempt|rest of this attempt|rest of this run|rest of run"
    "|current try|current episode|current round|current attempt|current run|remainder of this try|remainder of this episode|remainder of episode|remainder of try|remainder of this round|remainder of this attempt|this game|game|rest of this game|this trial|trial|rest of this trial|this whole episode|whole episode|whole try|this whole try|rest of this one|rest of it",
    "NEXTEPISODE": "next try|next episode|next round|next attempt|next run|next time|next one starts|next episode starts|next try starts|next episode begins|next try begins"
    "|this try is over|this episode is over|this round is over|this attempt is over|episode is over|try is over|round is over|end of episode|end of this episode|end of try|end of this try|end of round|end of this round|end of this attempt|episode ends|try ends|this episode ends|this try ends|new episode|new try|a new episode|a new try|this run is over|end of this run|attempt is over|this one is over|this try is done|this episode is done|this episode is finished|this try is finished|episode is finished|next trial|this trial is over|end of this trial|new round|a new round|next game|you start again|you start over",
    "EVER": "ever|forever|for ever|for good|always|for all time|for all times|in future|ever again|for rest of session|rest of session|whole session|for whole session|for rest of day|today|at all|until end of session|until session ends|until end|for always|ever more|from now on forever|permanently|for eternity|all time|until very end|under any circumstances|for rest of lesson|for whole lesson|in this session|this session|for this session|in this lesson|during this session|during session",
    "ONLYASK": "only|unless|except when|except if|only when|only if|until|until when|till|til|untill|not until|as long as you are not|other than when",
    "FOR": "for|during|in|over|within|throughout",
    "SESSION": "session|lesson|program|programme|teaching|training|whole thing|game|work|day|everything|practice|this session|this lesson|exercise|teaching session|this training|training session",
    "END": "end|finish|close|terminate|quit|exit|stop|shut down|abort|conclude|leave|complete|wrap up|finish off|stop now|ending|break off",
    "ALLDONE": "we are done|i am done|we are finished|i am finished|that is all|that is it|that is it for today|that is all for today|that is enough"
    "|that is enough for today|enough for today|enough for now|that will do|that will do for today|enough now|enough|enough already|i have had enough|let us stop|let us stop here|let us end here|let us finish"
    "|let us finish here|let us call it a day|call it a day|let us quit|stop now|bye|bye bye|good bye|goodbye|see you|see you tomorrow|see you later|good night|i have to go|i must go|i am leaving"
    "|i quit|i stop here|i give up|game over|over and out|that was it|that was all|all done|we are through|we can stop|we can stop here|we can stop now|we can end here|you can stop|you can stop now|you may stop|you may stop now|time to stop|it is time to stop|stop for today|stop everything|stop it all|no more for today|done for today|finished for today|we are done for today|we are done here|we are finished here|we are done now|i am done for today|i am done here|i am done now|that does it|let us leave it at that|leave it at that|we leave it at that|let us end it here|end it here|end it|stop teaching|i want to stop|i would like to stop|i want to quit|i would like to quit|i want to stop here|let us stop for today|let us end it|let us wrap up|let us wrap it up|wrap it up|pack up|we stop here|stop this|quit now|exit now|finish up|finish now|no more today",
    "STOPTHERE": "stop there|stop here|halt there|stop then|halt|end there|end here|finish here|finish there|come to a stop|come to a halt",
    "STAY": "stay there|wait there|remain there|stand still|stop moving|stand there|hold there|stay put|wait|stay",
    "UNIT": "steps|cell|cells|square|squares|tile|tiles|field|fields|moves|notch|notches|level|levels|space|spaces|position"
    "|positions|unit|units|pace|paces|grid cells|grid squares|spot|spots|floor tile|floor tiles|floor squares|grid steps|grid cell|little steps|small steps|single steps|click|clicks|hops|hop|ticks|tick|spaces over|layer|layers|storey|storeys",
    "STEP": "step|little step|small step|single step",
    "TIMES": "times|time|x",
    "EACH": "each|each time|each way|apiece|per direction|in each direction|of each|each of them|respectively|every time|in every direction",
    "MOVE": "move",
    "EVERYTHING": "everything|anything|all|anywhere|everywhere|all things|all of it|everything else|anything else|all rules|all objects|all of them",
}  # fmt: skip

GRID: Mapping[str, str] = {
    "LEFT": "left|leftwards|leftward|west|westward|westwards|left arrow|arrow left|leftmost|western|westerly|left hand",
    "RIGHT": "right|rightwards|rightward|east|eastward|eastwards|right arrow|arrow right|rightmost|eastern|easterly|right hand",
    "FORWARD": "forward|forwards|ahead|onward|onwards|north|northward|northwards|straight on|straight ahead|straight forward|straight forwards"
    "|straight north|dead ahead|front|northern|advance|top of picture|top of map|top of screen|top edge of picture|upper edge of picture"
    "|up in picture|up on map|up in map|far side|forth|northerly|away from you|top of image|straight on ahead|go ahead|move on ahead",
    "BACK": "back|backward|backwards|south|southward|southwards|rear|reverse|retreat|back up|back off|fall back|pull back|rearward|rearwards|southern"
    "|bottom of picture|bottom of map|bottom of screen|bottom edge of picture|lower edge of picture|down in picture|down on map|near side|in reverse|southerly|draw back|move back|step back|back away|backing up|backing off|bottom of image|backtrack|withdraw|go in reverse",
    "UP": "up|upward|upwards|up arrow|arrow up|upper|uppermost|topmost",
    "DOWN": "down|downward|downwards|down arrow|arrow down|bottommost|lowermost|lowest|underside",
    "TOP": "top|upper edge|top edge|upper side|top row|upper end|upper wall|top wall|upper border|highest point|upper rim|top end|top side",
    "BOTTOM": "bottom|lower edge|bottom edge|lower side|bottom row|lower end|lower wall|bottom wall|lower border|lowest point|lower rim|bottom end|bottom side",
    "HIGHER": "higher|rise|climb|ascend|lift|raise|elevate|lift up|rise up|climb up|raise up|go higher|rising|lift yourself|lift yourself up|climbing|highest|further up in air|gain height|into air",
    "LOWER": "lower|sink|descend|lower down|sink down|climb down|lower yourself|sinking|descending|drop|drop down|come lower|go lower|duck|lose height|nearer ground",
    "STRAIGHT": "straight|right straight",
    "DIAGONALLY": "diagonally|diagonal|at a slant|aslant|crosswise|in a diagonal",
    "CW": "clockwise|to right clockwise",
    "CCW": "counterclockwise|counter clockwise|anticlockwise|anti clockwise",
    "TURN": "turn|twist|rotate|spin|swivel|pivot|turns|turn yourself|rotate yourself|turning|rotation|quarter turn|rotations|spin yourself|turn hand|yaw",
    "GO": "go|drive|walk|run|head|travel|slide|shift|roll|ride|make|take|do|come|get|race|hurry|dash|stroll|creep|crawl|glide|sidestep|side step"
    "|going|moving|driving|walking|running|heading|sliding|coming|stepping|getting|making|taking|moves|goes|drives|be going|keep|find way|make way|work way"
    "|pick way|find your way|move yourself|bring yourself|push|advance by|jump|hop along|march|trot|wander|roam|sail|fly|float|nudge|budge|scoot|shuffle|inch|return|set off|start|begin|go off|be off|off you go"
    "|proceed to|carry on to|continue to|continue on|shifting|rolling|cruise|tiptoe|sneak|squeeze|trundle|amble|plod|steer|navigate|roll on|get going|get moving|put yourself|get yourself|take yourself|place yourself|position yourself|sidle|have|pull|zoom|ease|manoeuvre|maneuver|swing|veer|bear|edge along|travel along|tour|follow",
    "TO": "to|into|onto|towards|toward|unto|over to|off to|on to|in to|out to|all over to|across to|through to|in direction of|in direction|as far as to|up along to|over into|over towards|straight into|for direction of|along to|direction",
    "UPTO": "up until|right up to|as far as|so far as|until|till|til|untill|until when|up till|so long until|so long till|all way until|all way till|unless|intil|till when|to point where|to where|for as long as until",
    "ALLWAY": "all way|whole way|entire way|as far as possible|as far as you can|as far as you can go|as far as you can get|as far as it goes|as far as it will go|as far as is possible|as far as it is possible|as far as that goes|to very end|to end|up to end|until end|till end|to limit|to maximum|as much as possible|as much as you can|as far as is free|as far as it is free|until very end|completely|all along|as far as you may|fully|to stop|to very edge|to bitter end|as far as there is room|as far as way is free|as far as way goes|as long as it goes|as long as you can|as long as possible|as long as it is free|as long as way is free|while it is free|while you can|so far as possible|as far as can be|until further notice the same way|full way|max|as far as you are able|as far as you are able to|until no more|till no more",
    "AS": "as|just as|so",
    "FAR": "far|farther|further away|distant|more distant|remote|far away|farthest|furthest|most distant|most far|farest|further|remotest|faraway|far off|farther away|far one",
    "NEAREST": "nearest|closest|near|close|closer|nearer|nearby|nearest to you|closest to you|near to you|close to you|nearest to robot|closest to robot|nearer to you|closer to you|next to you|neighbouring|immediate|most near",
    "HIGH": "high|far up",
    "LOW": "low|far down",
    "POSSIBLE": "possible|possibly",
    "MIDDLE": "middle|central|centre|center",
    "BIG": "biggest|bigger|big|largest|larger|large",
    "SMALL": "smallest|smaller|small|tiny|little",
    "INFRONTOFYOU": "in front of you|in front of robot|ahead of you|ahead of robot|before you|right in front of you|directly in front of you|directly ahead of you|in your path|straight ahead of you|in front of us|right ahead of you|straight in front of you|just ahead of you|in your way",
    "INFRONT": "in front of|in front",
    "BEHIND": "behind|back of|rear of|behind back of",
    "NEXTTO": "next to|beside|besides|alongside|by side of|close to|close by|adjacent to|near to|close up to|right next to|right beside|right by|directly next to|directly beside|immediately next to|nearer to|closer to|in vicinity of|against|right at|close at|just next to|just beside|neighbour of|in neighbourhood of|right near",
    "AT": "at|in|on|inside|along|via|by way of|within|upon|on top of",
    "BY": "by|another by",
    "FROM": "from|out of|off",
    "OF": "of it|of that",
    "WITH": "with",
    "SIDE": "side|sides|hand side|flank|hand|edge of it|side of it",
    "WALL": "wall|edge|border|corner|boundary|limit|rim|end|ceiling|margin|frame|end of road|end of map|edge of map|border of map|end of floor|edge of floor|edge of board|end of board|edge of field|end of field|end of way|barrier|bound|end of line|end of row|end of column|end stop|limits|borders|edges|side wall|edge of picture|border of picture|picture edge|picture border|ground|end of room|edge of room|edge of grid|end of grid|border of grid|wall of room|end wall|boundaries|outer edge|outer wall|room wall|edge of world|end of world|margin of map|obstruction|dead end|end of track|end of corridor|extreme|stop point|next wall|very edge|very end|first obstacle|next obstacle|nearest obstacle ahead|an obstacle|any obstacle|some obstacle|first barrier|first thing",
    "SOMETHING": "something|anything|an object|any object|some object|whatever comes|an obstacle|any obstacle|some obstacle|whatever it is|what ever it is|some thing|whatever is there|obstacle of any kind|next thing",
    "HIT": "reach|reaches|reached|have reached|hit|hits|bump into|bumping into|bump|bump against|run into|run up against|run against|touch|touches|meet|meets|come up against|come against|strike|contact|have reached|reached|have hit|have met|met|have touched|encounter|encounters|collide with|crash into|come across|get to|come to|arrive at|arrived at|have arrived at|come up to|get up to|stand at|stand before|stand next to|feel|knock into|knock against|butt against|bang into|stop at|are stopped by|is stopped by|are blocked by|is blocked by|stand in front of|stand beside|end up at|are standing at|are standing next to|find|see|are touching|nearly touch|almost touch|are almost touching|come upon|come close to|get close to|come next to|get next to|are right at|are up against|are against|are level with|arrive next to|arrive beside|drive into|drive against|are up to|hit upon|come near|get near",
    "VISIT": "reach|visit|approach|head for|make for|aim for|go for|aim at|go see|seek|seek out|reaching|visiting|approaching|head off for|head straight for|make straight for|steer for|go directly for|bring yourself to|go up to|come up to|drive up to|walk up to|move up to|run up to|aim straight for|find way to|arrive at|get over to",
    "NEXTSTOP": "next stop|next destination|next target|next aim|destination|next goal|next place to go|next station|next port of call|next waypoint|target position",
    "FREE": "free|clear|open|unblocked|empty|unobstructed|available|passable|cleared|possible again|not blocked|no longer blocked|not blocked any more|not blocked anymore|free again|clear again|open again|vacant",
    "PAST": "past|passed|beyond|by and past|clear of|out of way of|gone past|got past|gotten past|come past|get past|cleared|have cleared|have passed|have gone past|have got past|are past|are beyond|are clear of|have left behind|leave behind|are free of|are out of way of|get beyond|went past|are by|moved past|have moved past|get around|have got around|got around|pass by it|have passed by|get clear of|can get past|can pass|left behind|have overcome|no longer next to|no longer beside|are no longer next to|are no longer beside|are no longer blocked by|no longer blocked by|not blocked by|are not blocked by|no longer behind|no longer under|no longer below|are not behind|are not under|are not below|are no longer under|are no longer below|are no longer behind|are rid of|get by",
    "INWAY": "in way|in your way|blocking you|blocking way|in front of you|blocking your way|before you|blocking|an obstacle|in path|in your path|ahead of you|in our way|blocking path|a hindrance|obstructing you|blocking your path|in my way",
    "NOTINWAY": "no longer in way|not in way|not in way any more|not in way anymore|out of way|no longer blocks|no longer blocks you|no longer blocks way|no longer blocks your way|does not block you|does not block|does not block way|does not block you any more|does not block you anymore|does not block any more|does not block anymore|does not block way any more|no longer blocking|no longer blocking you|no longer in front of you|not in front of you|not in front of you any more|not in front of you anymore|no longer before you|behind you|out of your way|no longer ahead of you|no longer in your way|no longer blocking way|no longer blocks path|no longer blocks your path|lies behind you|not blocking|not blocking you|no longer an obstacle|no longer stops you|no longer hinders you|does not hinder you|no longer in path|no longer in your path|not ahead of you|not ahead of you any more|stops blocking|stops blocking you|stops blocking way|no longer blocking your way|no longer blocking path|no longer blocking your path|does not block your way|is out of way|does not obstruct you|no longer obstructs you|no longer obstructs way",
    "WAY": "way|path|road|route|passage|lane|track|space|area|passage way|cell|view|gap",
    "BLOCKED": "something blocks|something blocks you|something blocks way|something is in way|something is in your way|something stops you|something is there|something comes|something is blocking|something gets in way|stuck|blocked|stopped|it stops|you stop|nothing is free|no more floor|no more room|no more space|there is no more floor|there is no more room|there is no more space|there is no floor|there is nothing more|there is nothing left|floor ends|map ends|way ends|road ends|path ends|room ends|it ends|it is over|you get stuck|you are stuck|you are blocked|you are stopped|way is blocked|path is blocked|it is blocked|floor runs out|room runs out|space runs out|you run out of floor|you run out of room|you run out of space|you run out of map|no further is possible|no more is possible|nothing more is possible|no more possible|not possible|not possible more|is not possible|is not possible more|is not possible any more|is not possible anymore|it is not possible|it is not possible more|it is not possible any more|it is not possible anymore|it is impossible|impossible|it does not go|it does not go any further|it does not go further|it does not go on|it goes no further|it can not go further|you can not|you can go no further|you can go no farther|you can not go|you can not go more|you can not go any more|you can not go anymore|you can not go further|you can not go any further|you can not go on|you can not go farther|you can not go any farther|you can not move|you can not move any more|you can not move any further|you can not move anymore|you can not move further|you can not get further|you can not get any further|you can not continue|you can not any more|you can not anymore|can not go|can not go further|can not go any further|can not go on|can not go any more|can not go anymore|can not continue|can not any more|can not anymore|can not move|can not move further|can not move any further|can not move any more|can not more|you can not more|you can move no further|you can no longer|you can no longer go|you can no longer move|you can no longer continue|can no longer go|can no longer move|no longer possible|it is no longer possible|is no longer possible|it is not possible to go further|it is not possible to go any further|it is not possible to continue|it is not possible to go on|it is not possible to move|there is an obstacle|an obstacle comes|an obstacle is in way|an obstacle stops you|an obstacle blocks you|obstacle|an obstacle|no way further|no way on|no road left|no floor left|no room left|no space left|there is no floor left|there is no room left|there is no space left|there is no way further|there is no way on|you have no more room|you have no more floor|you have no room left|you have no floor left|you have no more space|nothing goes any more|nothing more goes|it no longer goes|further is not possible|going further is impossible|you come to a stop|you get no further|you get blocked|you get stopped|you have to stop|you must stop|you need to stop|you hit something|you hit anything|you bump into something|you touch something|you touch anything|you meet something|you bump into anything|you run into something|you run into anything|you reach something|you collide|you bump|you crash|you bump into it|you come up against something|there is something|there is something in way|something is in front of you|something blocks your way|something blocks path|something stands in way|something is in path|something gets in your way|things get in way|there is something in front of you|way is no longer free|way is not free|path is not free|it is not free|it is no longer free|it is no longer clear|there is no more|no more|no more goes|you are at limit|it is full|floor is over|you would fall off|you fall off|you would leave map|you leave map",
    "KEEP": "keep|stay|remain|steer|hold|stay well|keep well|keep yourself|keep hand|drive always|be|staying|keeping|stays|stand|keep robot|keep a good way|keep moving well|keep good and|hold yourself|remain well|move",
    "KEEPINGTO": "keeping|keep|staying|stay|leaving it|passing it|passing|holding|going|driving|with a|by going|by passing|by driving|pass it|pass|choose|take|hold|hugging|using|use|moving|by moving|travelling|you go|but",
    "AWAY": "away from|clear of|clear from|off|out of|well clear of|well away from|far away from|far from|distance from|distance to|a distance from|at a distance from|away of|out of way of|back from|a good distance from|a safe distance from|safe distance from|safe distance to|clear away from|good distance from|enough distance from|enough distance to|some distance from|some distance to|a safe distance to|a good distance to|distant from|a wide distance from|afar from|at distance from|outside of|outside|out of reach of|at a safe distance from|as far away as possible from|as far as possible from|away as far as possible from|plenty of distance from|plenty of distance to|good way away from|good way off|a long way from|a long way away from|your hands off|hands off|your distance from|your distance to|apart from",
    "AWAYIT": "away|clear|off|out|distance|at a distance|back|well away|far away|well clear|your distance|a distance|a safe distance|hands off|at a safe distance|some distance|away there",
    "AVOID": "avoid|avoiding|shun|beware of|watch out for|look out for|be careful of|be careful with|mind|do not touch|do not hit|do not bump into|do not run into|do not approach|never touch|never approach|never hit|do not graze|hands off|dodge|evade|keep away from|stay away from|no touching|do not crash into|do not collide with|never crash into|never collide with|never run into|never bump into|do not brush|be wary of|steer clear of|keep clear of|stay clear of|keep distance to|keep distance from|do not enter|never enter|be careful near|be careful around|take care of not touching|make sure not to touch|make sure not to hit|make sure you do not touch|make sure you do not hit|take care not to touch|take care not to hit|be careful not to touch|be careful not to hit|watch out not to touch|make sure to avoid|be sure to avoid|keep avoiding|always avoid|do not disturb|do not get into contact with|never get into contact with|not touch|must not touch",
    "NONEAR": "no going near|no going close to|no driving near|no driving close to|no coming near|no coming close to|no moving near|no moving close to|no getting near|no getting close to|no approaching|not near|not close to|not so close to|not so near|not that close to|not too close to|not too near|no contact with|nowhere near|nothing near|not anywhere near|no closeness to|no moves near|no moves next to|no moves close to|no steps near|no steps next to|no step near|not next to|no cells near|no entry to|no way near|anywhere but near|no entering",
    "GONEAR": "go near|go close to|go close|get near|get close to|get close|come near|come close to|come close|drive near|drive close to|move near|move close to|move close|drive close|walk near|walk close to|go anywhere near|come anywhere near|get anywhere near|drive anywhere near|move anywhere near|go too near|go too close to|go too close|get too near|get too close to|get too close|come too near|come too close to|come too close|drive too near|drive too close to|drive too close|move too close to|move too near|move too close|be near|be close to|go next to|drive next to|be too close to|stay near|stay close to|pass near|pass close to|pass too close to|run near|approach|touch|pass too near|get so close to|get that close to|go so close to|come so close to|drive so close to|get next to|come next to|move next to|step next to|step near|step close to|go near to|get near to|come near to|drive near to|go too near to|get too near to|come too near to|go up to|go up close to|get up close to|go closer to|get closer to|come closer to|be next to|use cells next to|enter cells next to|go around near|step too close to|wander near|stray near|stray close to|stand next to|stand near|go right up to|drive up to|travel near|travel close to|go anywhere close to|get anywhere close to|come anywhere close to|move anywhere close to|go in vicinity of|set foot near|venture near|be anywhere near|go to|drive to|move to|go nearby|come nearby|get nearby|drive nearby|go through|drive through|go in there|go there|drive there|come there|go near there",
    "OFFLIMITS": "off limits|taboo|forbidden|a no go|a no go area|no go|no go area|prohibited|out of bounds|banned|a forbidden zone|a forbidden area|not to be touched|not to be approached|must not be touched|must not be approached|should not be touched|to be avoided|should be avoided|must be avoided|has to be avoided|should not be approached|may not be touched|may not be approached|can not be touched|a danger zone|a no go zone|no go zone|must never be touched|should never be touched|must never be approached|should never be approached|never to be touched|never to be approached|best avoided|better avoided|not to be entered|lava|a restricted area|restricted|untouchable|a taboo",
    "LEAVEALONE": "alone|in peace|untouched|be|well alone",
    "LEAVE": "leave|let|leaving",
    "GIVE": "give|allow|leave|grant",
    "BERTH": "a wide berth|wide berth|plenty of room|plenty of space|a lot of room|a lot of space|lots of room|lots of space|enough room|enough space|some space|some room|space|room|a good distance|a miss|a wide miss|more room|more space|a bit of room|a bit of space|a big berth|a respectful distance",
    "DANGER": "dangerous|hot|fragile|delicate|in way|in your way|hazardous|risky|unsafe|sharp|wet|precious|expensive|breakable|very hot|burning|burning hot|too hot|sensitive|unstable|in front of you|heavy|dirty|valuable|tricky|a danger|a problem|blocking you|blocking way|an obstacle|blocking your way|freshly painted|glued|broken|easily broken|wobbly|switched on|on|switched on now|still hot|electric|a hazard|in our way|loose|full|close|dear to me|live",
    "NOMORE": "no longer|not|not any longer|no more|not anymore|do not have to|need not|do not need to|no need to|there is no need to|you need not|you do not have to|you do not need to|you no longer have to|you no longer need to|no longer have to|no longer need to|stop|you can stop|you may stop|you need no longer|there is no longer any need to|no longer any need to|no need any more to|you must no longer|you are no longer required to|quit|it is no longer necessary to|no longer necessary to|not necessary to|it is not necessary to|you should no longer|you do not any longer have to|you do not any more have to|there is no longer a need to|you can now stop|it is not necessary any more to|never mind",
    "FORGET": "forget|forget about|drop|cancel|lift|take back|delete|remove|ignore|disregard|clear|erase|undo|revoke|withdraw|i take back|scrap|abolish|end|never mind|scratch|suspend|release|i withdraw|i lift|dismiss|give up|reset|stop obeying|stop following|no more|i cancel|throw out|discard|drop again|you can forget|you may forget|you can forget about|you may forget about|i revoke|i drop|you can drop|you can ignore|you may ignore|let go of|enough of",
    "RULE": "rule|rules|rule about|rules about|ban|bans|ban on|restriction|restrictions|restriction on|restriction about|prohibition|prohibitions|prohibition of|what i said about|what i told you about|what i said before about|what i told you before about|what i said earlier about|warning|warnings|warning about|warnings about|rule for|rule on|constraint|constraints|constraint on|constraint about|thing about|that thing about|order about|orders about|instruction about|instructions about|limits|limitations|limitation|my words about|my warning about|that rule about|this rule about|that rule|this rule|those rules|these rules|any rule about|ban of|ban around|my rule about|all rules about|everything i said about|everything i told you about|all i said about|restrictions about|restrictions on|ban for|rule concerning|what i said concerning|advice about|prohibition on|forbidden zones|no go areas|no go zones|every rule|all rules|all restrictions|all bans|any rules|all prohibitions|all of rules|every restriction|every ban|all constraints|all my rules|all of my rules|all warnings|avoidance rules|avoidance rule|earlier rules|earlier rule|old rules|old rule|previous rules|previous rule",
    "KEEPINGAWAY": "keeping away|staying away|keeping clear|staying clear|avoiding things|avoiding|keeping distance|keeping off|distance|distances|staying off|steering clear|avoidance|keeping your distance|avoiding objects|avoiding anything|not going near|not getting close|not going close|where not to go|where you may not go|where you can not go|where you must not go|not going there|no go areas|forbidden places|staying out",
    "WHATISAID": "what i said|what i told you|everything i said|everything i told you|all i said|all i told you|what i said before|what i told you before|what i said earlier|everything i said before",
    "AROUND": "around|round|around about|past|by way around|way around|way round|circuit around|along and around|back around|beyond|outside around|over past|right past|by going around|a detour around|detour around|a curve around|curve around|an arc around|arc around|a loop around|loop around|a bow around|a way around|a path around|path around|a turn around|about",
    "PASS": "pass|passing|bypass|circumvent|skirt|circle|circumnavigate|pass by|go by|drive by|walk by|move by|drive around|go around|go round|drive round|get around|get round|detour|sidestep|move past|go past|get past|walk past|drive past|walk around|walk round|move around|move round|run around|run round|slip past|slide past|squeeze past|curve around|curve round|steer around|steer round|work way around|work way round|make way around|find way around|navigate around|navigate round|come around|come round|come past|circle around|circle round|pass around|bypassing|circling|skirting|run past|head around|head round|head past|step around|swing around|swing round|roll around|travel around|loop around|pass along|travel past|roll past|sneak past|overtake|round|slide around|make a detour around|take a detour around|make a curve around|make a bow around|make a circle around|make an arc around|make a loop around|make a turn around|get by|slip by|squeeze by|take way around|take path around|take route around|edge around|edge past|go along|drive along|move along|wind way around|sweep around|veer around|bend around|going around|driving around|walking around|moving around|going past|driving past|walking past|moving past|dodge around|hug",
    "LONG": "long|wide|short|large",
    "OVER": "over|above|over top of|over the top of",
    "UNDER": "under|below|beneath|underneath",
    "DEGREES": "degrees|degree|deg",
    "ONE": "one",
    "YOUAT": "you are|you have|you get|it is|you will be|you come|you stand|it gets|you were|we are|you will have",
}  # fmt: skip

LENGTHS: Mapping[str, float] = {
    **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), 0.1),
    **dict.fromkeys(("cm", "centimetre", "centimetres", "centimeter", "centimeters", "cms", "centi"), 1.0),
    **dict.fromkeys(("dm", "decimetre", "decimetres", "decimeter", "decimeters"), 10.0),
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters", "mtr"), 100.0),
    **dict.fromkeys(("inch", "inches"), 2.54),
}  # in cm

ORDER: Mapping[str, str] = {
    "PUT": "put|move|bring|take|send|place|load|get|transfer|carry|transport|deliver|shift|set|lay|drop|transferring|feed|insert|stick|pass|hand|fetch|pick up|pick|return|putting|moving|have|go with|go on with|continue with|proceed with|move on with|hand over|pop|slide|want|give|convey|haul|next move|next|choose|do|make|run|start|process|handle|treat|goes|go|moves|comes|should go|must go|can go|has to go|needs to go|let|gets|is to go|ought to go|will go|may go|take care of|belongs|is next|is going|use|serve",
    "GOES": "goes|go|moves|should go|must go|can go|has to go|needs to go|is to go|will go|may go|move|belongs|comes|is going|should be put|must be put|is put|should be moved|must be moved|is moved|has to be put|gets put|should be brought|shall go|could go|goes back|gets moved|should move|is to be moved|is to be put|can be moved|can be put|may be put|may be moved|needs to be moved|should be taken|is taken|travels|wants|should now go|can now go|needs",
    "TO": "to|into|onto|in|on|towards|over to|in to|on to|inside|at|back to|back into|back onto|back in|back on|back at|off to|through to|toward|over into|across to|straight to|straight into|upon|up to|out to|out onto|on top of",
    "FROM": "from|out of|off|away from|out from|off of|leaving|at|in|on|which is in|which is on|that is in|that is on|that is at|which is at|waiting in|waiting on|waiting at|coming from|over from|currently in|currently on|currently at|from out of",
    "WITHTHE": "with|using",
    "BACK": "back|again|over",
    "NUMBER": "number|no|nr|option|move|move number|move no|option number|choice|no.|the number|alternative|line|item|entry|row|transfer|possibility",
    "THING": "part|piece|thing|item|workpiece|bit|component|parts|pieces|things|items|workpieces|components|any part|any piece|any item|any thing|a part|a piece|a thing|an item|any parts|anything|any workpiece|any of parts|something|a workpiece|any component|any of them|any|parts at all|one part|stuff|any 1|job|jobs|any job|work|any of pieces|product|products|goods|material",
    "NOTHING": "nothing|no part|no piece|no item|no thing|no parts|no pieces|no items|no workpiece|none of parts|no 1 part|no component|none of them|none|no single part|not 1 part|not a single part|no workpieces|no components|no part at all|not any part|no job|nothing at all|not anything|no product|no products",
    "FINISH": "finish|complete|finish off|finalise|finalize|get done with|see through|bring to end|bring to an end|finish up|do|finish with|finishing|completing|wrap up|get finished with|get finished|get through|process completely|conclude|first finish|first complete|finish working on|complete work on|finish work on|bring to completion|get ready|make ready|finish processing|do all of|end|get done|get rid of|first do|carry through",
    "STRONGFINISH": "finish|complete|finish off|finalise|finalize|get done with|bring to an end|finish up|finish with|finishing|completing|wrap up|get finished with|process completely|finish working on|complete work on|finish work on|finish processing|bring to completion|bring to end|conclude|see through to end|carry through to end|get finished",
    "WORKON": "work on|concentrate on|focus on|stick to|stick with|stay with|keep to|keep working on|go on with|continue with|carry on with|keep at|keep going with|keep on with|deal with|only work on|work only on|work just on|concentrate only on|focus only on|focus just on|attend to|only do|do only|do nothing but|only handle|take care of|only move|move only|deal only with|stick only to|turn to|put all effort into|continue working on|remain with|stay on|keep|handle|move|do",
    "STRONGWORKON": "concentrate on|focus on|stick to|stick with|stay with|keep at|keep going with|keep on with|only work on|work only on|work just on|concentrate only on|focus only on|focus just on|only do|do only|do nothing but|deal only with|stick only to|keep working on|continue working on|concentrate just on|focus your work on|focus all work on|concentrate your work on|only handle|only deal with|first work on|first concentrate on|first focus on",
    "UNTILDONE": "until it is done|until it is finished|until it is complete|until it is completed|till it is done|till it is finished|until done|until finished|till done|until completion|until complete|until completed|until it is ready|until that is done|until that is finished|until it is completely done|until it is completely finished|to end|to very end|until end|till end|until it is out|until it is through|until it is all done|till finished|till it is complete|until it has been finished|until it is over|until its finished|until its done|until it leaves|till it is ready|until it is delivered|until it gets done|until it is finished completely|until it is done completely|to completion|right to end|until this 1 is done|until it is fully done|until ready|until it is fully finished|until you are done with it|until you have finished it|until you finish it|until you are finished with it|until you have completed it|until it is off table|until it has finished|until it is on tray|until finished completely|until very end|till very end|all way through|all way to end|through to end|from start to finish|as long as it is not done|as long as it is not finished|until that 1 is done|until that 1 is finished|till that is done|till that is finished|until it is completely through|till it is through|till completion|until this is done|until this is finished|until it is at end|up to end|before you do anything else",
    "UNTIL": "until|till|til|before|untill|unless",
    "FIRST": "first|firstly|first of all|at first|to begin with|to start with|as first|before everything else|before anything else|before everything|before all else|before others|before other parts|before all others|before all other parts|before rest|before other 1s|before other 1|before any other part|before any other|before any others|ahead of everything else|ahead of others|ahead of all others|ahead of rest|ahead of everything|ahead of other parts|before you do anything else|before anything|before you start anything else|before you touch anything else|before you begin anything else|before doing anything else|before starting anything else|before touching anything else|before remaining parts|as first thing|as very first|in first place|as first 1|before you go on|before you continue|before you turn to others|before you touch others|before you start others|before you move anything else|before moving anything else|before you do others|before you do rest|before you move others|before moving on|before all of others|before you move on|before other things|before other slices|before everyone else|as top priority|with priority|with top priority|with highest priority|as soon as possible|asap|as a priority|before you handle anything else|before you work on anything else|before working on anything else|before any of others|1st|before others are touched|before anything else is touched|before others get their turn|before other stuff|foremost|first and foremost|as no 1|as number 1|with first priority|as your first priority|as first priority|before you take next 1|before next 1|before another 1|before starting another|before you start another|before you start another 1",
    "REALFIRST": "before everything else|before anything else|before everything|before all else|before others|before other parts|before all others|before all other parts|before rest|before any other part|before any other|before any others|ahead of everything else|ahead of others|ahead of all others|ahead of rest|ahead of everything|ahead of other parts|before you do anything else|before other 1s|with priority|with top priority|with highest priority|as top priority|first and foremost|as a priority|before remaining parts|before other slices|before all of others|before other things|before doing anything else|before you touch anything else|before you start anything else|before anything",
    "PRIORITY": "has priority|has top priority|gets priority|takes priority|has precedence|takes precedence|has highest priority|is top priority|is priority|is your priority|is your top priority|is most important|is most urgent|is most important 1|gets top priority|is priority number 1|is first priority|is number 1|is no 1|comes first of all|should have priority|must have priority|should get priority|is main thing|is more important than others|is more important than rest|is more important than everything else|matters most|must be finished first|should be finished first|must be done first|should be done first|has to be done first|has to be finished first|is to be finished first|needs to be finished first|needs to be done first|must be completed first|should be completed first|has to be completed first|gets finished first|gets done first|is finished first|is done first|is to be done first|must be ready first|should be ready first|has to be ready first|must come first|should come first|comes first|goes first|should go first|must go first|has to go first|has to come first|is first|should be first|must be first|has to be first|is to be first|needs to come first|needs to be first|needs priority|deserves priority|has right of way|is wanted first|is needed first|shall be finished first|shall be done first|i want finished first|i want done first|i need first|i want first|is highest priority|enjoys priority|first priority|top priority|first in line|is first in line|takes first place|has absolute priority|has first priority|before others",
    "PRIORITISE": "prioritise|prioritize|give priority to|give precedence to|give top priority to|favour|favor|prefer|give preference to|give highest priority to|put first|priority to|top priority to|priority for|top priority for|give absolute priority to|first priority to|first priority for|let first",
    "GETDONE": "get|have|i want|want|need|let|make|see|i need",
    "DONE": "done|finished|completed|complete|ready|over|through|out|done with|finished with|all done|off table|out of way|finished completely|completely finished|completely done|fully done|fully finished|finalised|finalized|finished up|is done|be done|finished off|be finished|is finished|is ready|is complete|is completed|has been done|has been finished|are done|are finished|is through|is out|was done|be ready|be completed",
    "COMPLETELY": "completely|entirely|fully|wholly|all way|at once|in 1 go|to end|now|through|totally|right now|off|in 1 piece|without interruption|straight through|all of it|in whole|right away|as soon as possible|without a break",
    "REST": "rest|others|other parts|all others|everything else|remaining parts|other 1s|rest of them|rest of parts|anything else|remaining 1s|other things|all rest|everything|do rest|do others|other slices|rest can wait|others can wait|rest later|others later|others after|rest after|everything else can wait|everything else after|others must wait|rest must wait|rest has to wait|other parts can wait|others have to wait|everything else must wait|others should wait|leave others|leave rest|no other part|nothing else|nothing in between|only then others|only then rest|then rest|all other parts can wait|all others can wait|other 1s can wait|others come later|others come after|rest comes later|rest comes after|everything else comes later|everything else later|everything else comes after|others come after that|rest comes after that|rest follows|others follow|all else can wait|forget rest|let others wait|let rest wait|other parts later|other parts after|other parts must wait|other parts come later|go on with others|go on with rest|continue with others|continue with rest|leave others for later|only after that others|only after that rest|others afterwards|rest afterwards|anything else can wait|leave rest for later",
    "LET": "let|leave|keep|allow|have|permit|leaving|letting|make|keeping|see|allowing|find|store|want|having|get|forget|put down|tolerate|abandon|i want|i want to see|i want to find|i do not want",
    "LEAVE": "leave|leaving|keep|keeping|forget|store|abandon|park|left|leave behind|hold|deposit|strand|forgetting|dump|storing|parking|have",
    "WAIT": "wait|waiting|sit|sitting|stay|staying|stand|standing|rest|resting|remain|remaining|lie|lying|linger|lingering|idle|idling|hang around|hanging around|park|parked|be left|left|wait around|waiting around|sit around|sitting around|stand around|standing around|lie around|lying around|stay around|be kept|kept|stuck|be stuck|get stuck|be kept waiting|kept waiting|be left waiting|left waiting|be left standing|left standing|be left lying|left lying|be left sitting|left sitting|be waiting|be sitting|be standing|be parked|stay behind|left behind|be left behind|remain behind|be stored|stored|hang about|loiter|be lying|be forgotten|forgotten|left alone|sit waiting|stay waiting|pile up|queue|queue up|rot|burn|go cold|get cold|be left alone|just sit|just wait|just stand|just stay|be left around|left around|be left to wait|left to wait|be made to wait|made to wait|wait for long|wait too long|stay too long|stay longer than needed|stay longer than necessary|wait long|sit too long|stay long|stay in there|be idle|idle around|waits|sits|stays|stands|rests|remains|lies|be lying around|be left lying around|left lying around|be left sitting around|left sitting around|left idle|be left idle|stay unattended|be unattended|be left unattended|left unattended|unattended|be held|held|be left to sit|left to sit|have to wait|be allowed to wait|be left to rest|waste time|dwell|lounge|gather dust|block|collect|accumulate|be left there|be held up|held up|hold up|delay|be delayed|stand idle|be left to stand|end up waiting|be found waiting|be caught waiting|get left|get left behind|spend time waiting|be put to wait|stop|be left for long|be left too long|left too long|stay for long|stay for too long|wait for too long|be left for too long|stand for too long|sit for too long|lie for too long|remain for long|remain for too long|remain too long|stand too long|lie too long|when done|be left in peace",
    "WAITINGNO": "no waiting|no sitting|no sitting around|no lingering|no parking|no waiting around|no standing around|no storing|no idling|waiting is forbidden|no leaving|no staying|no resting",
    "MODAL": "must|may|can|should|shall|will|is allowed to|is to|are to|has to|ought to|could|might|does|do|are allowed to|is|are|would",
    "NOTALLOWED": "is not allowed to|is not to|are not to|are not allowed to|is never to|are never to|is forbidden to|must not|may not|can not|should not|shall not|will not|should never|must never|may never|can never|shall never|will never|is not supposed to|is never allowed to|are never allowed to|does not|never|not|is not meant to|has no business|ought not to|ought not|do not|must not ever|may not ever|is never supposed to|are not supposed to|must by no means|must under no circumstances|may under no circumstances|must not be allowed to|should not be allowed to|should never be allowed to|must never be allowed to|should not have to|must not have to|should never have to|must never have to|needs not to|needs never to|is forbidden from|is never|is not|are never|are not|under no circumstances may|may at no time|must at no time|is not permitted to|are not permitted to|would not|is prohibited from|ought never to",
    "NEVERDO": "never|do not|do not ever|never ever|at no time|under no circumstances|you must not|you must never|you should not|you should never|you may not|you may never|you can not|not|make sure not to|make sure never to|be sure not to|take care not to|see to it not to|please never|in no case|avoid|avoid to|i do not want you to|do not you|do not you ever|by no means|stop|try not to|be careful not to|make sure that you never|make sure that you do not|make sure you never|make sure you do not|try never to|you shall not|you shall never|i never want you to|refrain from|not ever|you are not to|you are never to|you are not allowed to|quit|take care never to|see that you never|see that you do not|see to it that you never|see to it that you do not|i would never|never again",
    "NEVERSEE": "i never want to see|i do not want to see|i never want|i do not want|i do not want to find|i never want to find|i do not want to have|i do not like|i do not like to see|i want no|i do not ever want to see|i hate to see|i hate|we do not want|i would rather not see|no one wants|nobody wants|i do not ever want",
    "MAKESURE": "make sure|make sure that|see to it that|take care that|ensure|ensure that|be sure that|be sure|see that|remember|remember that|remember to|watch that|watch out that|mind that|note that|keep in mind that|take care|from now on|always|in general|as a rule|it is important that|important|rule|new rule|a rule|a new rule|be careful that|look that|it must never happen that|attention|in future|generally|new rule for you|my rule|i insist that|i demand that|please note that|it is important to|be so good and|house rule|always remember|always make sure that|always make sure|remember always|for future|rule 1|strict rule|golden rule",
    "BEFORE": "before|prior to|ahead of|earlier than|sooner than|in front of|preceding|precedes|before that|comes before|goes before|must come before|should come before|goes ahead of|comes ahead of|must go before|should go before|has to come before|has to go before|is to come before|is before|must be before|should be before|must precede|should precede|has to precede|comes earlier than|goes earlier than|has priority over|takes priority over|takes precedence over|has precedence over|over|must happen before|should happen before|happens before|has to happen before|must be done before|should be done before|is done before|has to be done before|gets its turn before|is handled before|is more important than|is more urgent than|always before|must be finished before|should be finished before|must always come before|always comes before|should always come before|is up before|needs to come before|needs to go before|must be ready before|is served before|has to be finished before|gets done before|needs to be done before|is finished before|in advance of|must be dealt with before|shall come before|shall go before|must be moved before|should be moved before|is moved before|is due before|needs to happen before|gets moved before|is more pressing than|needs to be finished before|is processed before|is first then|gets priority over|beats|should take priority over|should have priority over|must have priority over|should get priority over|must take priority over|goes first before|comes first before|in preference to|rather than|well before|shortly before|right before|directly before",
    "AFTER": "after|only after|once|when|as soon as|later than|not before|not until|behind|following|only when|only once|follows|comes after|goes after|must come after|should come after|comes only after|goes only after|must wait until|has to wait until|waits until|should wait until|only as soon as|must go after|should go after|has to come after|is after|can wait until|must wait for|has to wait for|waits for|should wait for|is to wait until|comes later than|must wait till|has to wait till|waits till|must follow|should follow|only later than|never before|must not come before|should not come before|must not go before|should not go before|may not come before|may not go before|can not come before|must never come before|never comes before|may only come after|may come only after|may only go after|should only come after|should only go after|can only come after|must only come after|comes not before|must happen after|should happen after|only if|comes once|can only go after|only comes after|only goes after|has to happen after|has to follow|needs to wait until|needs to wait for|can wait for|may wait for|may wait until|must be done after|should be done after|but only after|but only once|but only when|but not before|but not until|not earlier than|only following|must not be done before|should not be done before|only begins after|only starts after|gets its turn after|is due after|only then when|is done after|has to be done after|must always come after|always comes after|always after|no earlier than|no sooner than|should be moved after|must be moved after|is moved after|has to wait till|can wait till|and only after that",
    "ONLY": "only",
    "NOBEFORE": "no|not|never|do not|do not start|do not begin|not start|not begin|must not|not do|do no|never do|do not do|never start|never begin|do not you|do not go on with|do not make|do not even think of|no more|never make|you must not|you should not|you may not|you may never|you must never|you should never|under no circumstances|by no means|hold|delay|postpone|wait with|hold off|hold off with|hold back|put off|do not touch|do not move|never move|never touch|do not handle|do not work on|do not continue with|do not proceed with|leave|do not take|never take|hold back with|do not let|do not send|do not put|do not have|keep",
    "HOLDUP": "hold|delay|postpone|wait with|hold off|hold off with|hold back|put off|hold back with|hold off on|leave|defer|wait with moving|keep|let wait|pause",
    "EACHTIME": "always|each time|every time|in each case|in every case|generally|from now on|in future|ever",
    "NEXT": "next|following|coming|another|new|other|upcoming|next time|a new|a",
    "DO": "do|you|start|begin|be|is|are|get|gets|finish|go|make|doing|starting|we|have|has|been|had|it|moving|move|being|you do|you start|you begin|you go|you make|you finish|you have|handle|come|comes|you move|i|you touch|touching|you take|taking|process|processing|start with|begin with|handling|work on|you work on|you handle|put|putting|you put|you get|getting|you bring|bring|bringing|finishing|complete|completing|you complete|you start with|you begin with|you let|let|send|sending|you send|take|load|loading|you load|you are|was|were|has been|have been|is being|does|goes|moves|may be|can be|must be|should be|may|can|must|should|it is|it has been|will be|leave|leaves|enters|enter|you have finished|you have done|you are done with|finish with|you finish with|i do|i get|that is|deal with|you deal with|dealing with|turn to|you turn to|go on with|you go on with|continue with|you continue with|moves to|gets to go|may go|can go|should go|must go|turn|has had its turn at|begins|starts|beginning|use|using|you use|continue|proceed with|you proceed with|shall|will|has|run|running|doing any|any|some|any more|more|do some|do any|do a|do all|all|do all of",
    "WITHOUT": "without|no|not|skip|skipping|and no|but no|instead of|never mind|forget|not to|not into|rather than|avoid|leave out|leaving out|but not|omit|omitting|not in|not on",
    "HAVEDONE": "is|was|has been|gets|has got|are|have been|been|being|be|is being|got|once|must be|should be|has to be|needs to be|were|will be|has|may be|can be|is to be|had been|may only be|can only be|must only be|should only be|may get|can get|should get|must get|shall be|shall get",
}  # fmt: skip

# phrases of one rule of the grammar each
PHRASES: Mapping[str, str] = {
    "BEFORE_NEXT": "before",
    "CONTINUE_MV": "continue|proceed",
    "VISIT_MV": "advance",
    "LEAVE_MV": "back",
    "UNTIL_TO": "up|over",
    "UP_AND": "up and",
    "SEE": "see",
    "PAST_BEHIND": "behind",
    "PAST_IT": "past it|past|by|on",
    "NOTHING_MORE": "nothing|nothing more|nothing else",
    "TO_UP": "up",
    "TO_UNTIL": "all way to|as far as|right to",
    "NEXTTO_BE": "there at|at end of|before",
    "FROM_OFF": "off|over|along|right over|all way|all way over|out|across|back over",
    "UP_NEXT": "up",
    "TO_THERE": "where",
    "OF_PREP": "of",
    "ON": "on",
    "AWAY_AT": "at a distance|at arm s length|at a safe distance",
    "ANYWHERE_BUT": "anywhere but|everywhere but",
    "TOUCH": "touch",
    "OFFLIMITS_NO": "no longer to be avoided|no longer forbidden|not to be avoided any more",
    "AVOID_BE": "be avoided",
    "ABOUT": "about|with|that|for|concerning|regarding",
    "NOTHING_ABOUT": "what i said about|about",
    "FROM_ABOUT": "from|of|clear of|off",
    "OKTAIL": "after all",
    "TAKE": "take",
    "BACK_ALL": "back",
    "GO_FREELY": "freely|wherever you like|where you like|where you want|wherever you want|as you like",
    "OFF_GONE": "off|gone|cancelled|void|lifted|over|no longer valid|no longer hold|no longer apply|do not apply any more|do not hold any more|do not count any more|are off|invalid|dropped|removed",
    "OFF_ALL": "off again",
    "NOT_THAT": "not like that|not like this",
    "DANGER_DO": "can break|breaks easily|may break|could break|blocks you|blocks your way|blocks way|burns|may fall|might fall|could fall|stands in your way|can burn you|falls over easily|tips over easily",
    "THEM": "it",
    "OTHER_NONE": "whole|old|damn|same",
    "OTHER_POST": "thing|over there|there|again|here|object",
    "WHICH": "which is|that is|who is|lying|standing|which stands|which lies|that stands|that lies",
    "O_TO_WITH": "with",
    "O_NEXT_NOW": "next please|is next|s turn|next 1",
    "O_FIRST_NOW": "first|as first step|as next step|as next move",
    "O_PRIORITY_WORDS": "top priority|first priority|priority|first",
    "O_PRIORITY_TAIL": "priority|top priority|first priority|precedence",
    "O_NOSEE": "never see",
    "O_LEFT": "left",
    "O_EVER": "ever",
    "O_WAIT_WITH": "wait with|stay with",
    "O_FROM_AT": "by|inside of|within",
    "O_AROUND_IN": "around in|around on|about in|about on",
    "O_NEVERTAIL": "for long|when it is done|once it is done|when done|waiting|too long|to wait|there|alone|unattended|any longer than needed|longer than needed|longer than necessary|at any time|when finished|after it is done|when it is finished|any more|standing|sitting|lying around|standing around|sitting around|lying|idle|for too long|around|any longer",
    "O_LET_WAIT": "let|make|have",
    "O_DO_START": "start|begin|be started|be moved|be touched|be done|move|happen|be put|come",
    "O_BEFORETAIL": "in line|in order|in queue",
    "O_NEXT_DONE": "first",
    "O_OF": "of",
    "O_ONE": "1",
    "OPEN_ORDER": "any order is fine|any order is fine again|order is free again|any order is allowed|any order is allowed again|order does not matter any more",
    "O_URGENT": "urgent|important|most urgent|most important|late|needed|needed soon|in hurry|overdue|hungry|in a hurry|needed urgently|needed first|due",
    "O_URGENT_DO": "burns|burns easily|burns quickly|gets cold|will burn|would burn|is in a hurry|rusts|gets hot|goes cold|would get cold",
    "EVERY": "any|some|any of|each|every|all",
}  # fmt: skip
